"""Light models: ambient occlusion, diffuse irradiance, directional light, and changes of light."""
