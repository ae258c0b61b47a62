"""Decision: from fitted effects to a verdict."""
