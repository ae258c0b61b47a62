"""What all kinds share when they are reduced."""
