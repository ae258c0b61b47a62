"""``stickslip table1``: the mesh study of Table 1 in the paper."""
