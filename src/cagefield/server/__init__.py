"""The editor behind `cagefield view`: its state, its renderer's process, and the socket that pages talk to."""
