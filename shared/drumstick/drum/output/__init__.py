"""From the head to samples: microphones, upsampling, limiter, stems, and what is shown of the surface."""
