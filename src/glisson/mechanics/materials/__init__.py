"""Material laws, one small file each."""
