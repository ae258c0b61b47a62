"""``stickslip diagnose``, ``add`` and ``undo``: which effect a case lacks."""
