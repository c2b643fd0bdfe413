"""What is refused by name, with what to do instead."""
