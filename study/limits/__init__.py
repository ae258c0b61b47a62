"""``stickslip limits``: the band of responses over unknown friction history."""
