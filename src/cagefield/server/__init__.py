"""The editor behind `cagefield view`: its state, its rendering process, and the socket pages talk to."""
