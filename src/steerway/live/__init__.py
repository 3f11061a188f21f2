"""On the boat, in real time: links to instruments and consumers, and the clock between them."""
