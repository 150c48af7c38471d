"""Images: render results, image files, video, metrics."""
