"""What holds a case together: folder, settings, provenance, and the pipeline that runs what is stale."""
