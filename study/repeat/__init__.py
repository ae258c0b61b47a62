"""`stickslip repeat`: repetition of a result from its recorded command, inputs and versions."""
