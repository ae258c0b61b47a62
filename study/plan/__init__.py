"""`stickslip plan`: effects that planned tests would detect."""
