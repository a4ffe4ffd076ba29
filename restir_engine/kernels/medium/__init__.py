"""Light inside a homogeneous medium, and what an artist says about one."""
