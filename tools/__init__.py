"""What developers run: building the extension's zip."""
