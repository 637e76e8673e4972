"""What uses the compiler and is not used by it: editors, the formatter, importers, diff."""
