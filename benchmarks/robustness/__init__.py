"""Long runs that damage files, kill commands, fill disks and flood the editor."""
