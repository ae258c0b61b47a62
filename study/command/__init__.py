"""Commands of `stickslip`, one file per command; each is imported only when it is called."""
