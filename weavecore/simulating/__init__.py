"""The structural stage: where a weave of elastic rods comes to rest, and the forces in it."""
