"""From the distance field to latitudes: level sets traced, simplified, and the bands between them."""
