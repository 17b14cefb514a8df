"""The commands, one file each; `weavecore.cli` puts them together."""
