"""Files that no person would write, and what the compiler makes of them."""
