"""Structure from motion, and the verification of poses."""
