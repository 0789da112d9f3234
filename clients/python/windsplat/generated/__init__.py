"""Written by generate_view_types.py."""
