"""What files declare: models, composites, disturbances, studies and settings from outside, as frozen declarations."""
