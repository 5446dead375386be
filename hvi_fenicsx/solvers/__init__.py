"""The solution methods, one file each, and nested iteration."""
