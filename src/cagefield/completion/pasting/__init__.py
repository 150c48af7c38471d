"""Content of pastes, read from other scenes."""
