"""Reports of recorded runs: one file of HTML that shows what the page shows, without a server."""
