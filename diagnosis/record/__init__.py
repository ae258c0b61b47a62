"""What is missing from a model that is compared with time records."""
