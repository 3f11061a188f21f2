"""Links to instruments and consumers, one kind per file. A link runs until cancelled and reopens when it breaks."""
