"""What Grasshopper's files are made of, written without Grasshopper: archives, components, a definition, a package."""
