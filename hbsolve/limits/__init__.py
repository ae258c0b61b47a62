"""Response limits: the largest and smallest steady response that unknown friction history can produce."""
