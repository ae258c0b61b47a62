"""What looks wrong in a campaign, by its data alone and beside a model, each with its evidence in numbers."""
