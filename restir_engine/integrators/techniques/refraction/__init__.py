"""Light that crosses an object straight (HYBRID's boundary term): the sample is a direction and a point of a light."""
