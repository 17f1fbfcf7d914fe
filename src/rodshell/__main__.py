"""`python -m rodshell`: the command line of this interpreter, whatever `rodshell` is on the path."""

from rodshell.cli import entry

if __name__ == "__main__":
    entry()
