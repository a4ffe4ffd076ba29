"""Pictures by Mitsuba 3, a renderer that we did not write."""
