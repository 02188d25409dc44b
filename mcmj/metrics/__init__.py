"""Numbers that judge a run; each name says its definition."""
