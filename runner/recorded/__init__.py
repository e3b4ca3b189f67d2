"""What was recorded outside of runs: channels fitted to measured traces, and recordings that pass disturbances."""
