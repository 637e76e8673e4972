"""Machines composed with their buffers and explored from their initial states (`specc explore`)."""
