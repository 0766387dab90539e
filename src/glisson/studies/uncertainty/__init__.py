"""Whether error bars of registrations hold, and what a touch where they say to touch next is worth."""
