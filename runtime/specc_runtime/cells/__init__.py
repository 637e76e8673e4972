"""What belongs to one robot cell: its devices, scene and judge."""
