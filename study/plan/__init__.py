"""`stickslip plan`: which effects planned tests would show, before any is made."""
