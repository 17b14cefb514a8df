"""Pictures of what the stages give."""
