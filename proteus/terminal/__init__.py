"""What the terminal shows: tables or JSON on stdout; messages and progress on stderr."""
