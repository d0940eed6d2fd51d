"""Everything that touches USD (pxr): writing takes, reading them back, checking them."""
