"""Pictures, pages and summaries of the stages' results."""
