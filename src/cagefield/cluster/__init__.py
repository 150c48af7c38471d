"""Work on many machines: frames of a scene, rendered by the workers of a dask.distributed cluster."""
