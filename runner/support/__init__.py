"""What every room uses: text and HTML for people, statistics, interrupts, declared parameters."""
