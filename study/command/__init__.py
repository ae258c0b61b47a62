"""One file a command of `stickslip`; each is imported only when it is called."""
