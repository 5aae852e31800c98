"""Lines of bytes: serial ports, and firmware models in the place of one."""
