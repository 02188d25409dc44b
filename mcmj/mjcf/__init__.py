"""Bodies as MJCF files: written, checked, read to the bit, drawn; the files that come with mcmj."""
