"""Bodies as environments of dm_control and Gymnasium."""
