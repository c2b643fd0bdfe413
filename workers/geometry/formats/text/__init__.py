"""Text as readers take it: encodings, numbers however they are spelt, and tokens."""
