"""What people, programs and assistants call: Python, the command line, the browser."""
