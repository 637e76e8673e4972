"""Many runs of a specification over values of constants and over seeds, as one table."""
