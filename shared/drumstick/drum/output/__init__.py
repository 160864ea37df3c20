"""From the head to samples: microphones, upsampling, limiter, and what is shown of the surface."""
