"""Light of edits: ambient occlusion, shadows, irradiance."""
