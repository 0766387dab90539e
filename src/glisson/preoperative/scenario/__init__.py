"""The manoeuvre that is proposed: where a lever would go."""
