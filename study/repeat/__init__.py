"""`stickslip repeat`: a result made again from what it says that it was made by."""
