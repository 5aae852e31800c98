"""What a session works with: who moves the stands, what reads the air, one world."""
