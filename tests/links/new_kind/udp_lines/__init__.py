"""A kind of link that no other part of the gateway knows: values as JSON lines over UDP, and writes back."""
