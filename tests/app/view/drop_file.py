#!/usr/bin/env python3
"""drop_file.py WINDOW FILE: drops a file onto a window of X11, as a file manager does (XDND 5).
Fails if the window does not take it. Needs libX11."""

import ctypes
import pathlib
import sys

CLIENT_MESSAGE, SELECTION_REQUEST, SELECTION_NOTIFY = 33, 30, 31

# XEvent of 64-bit systems, as an array of 24 longs: places of its members.
SEND_EVENT, WINDOW, MESSAGE_TYPE, FORMAT, DATA = 2, 4, 5, 6, 7
REQUESTOR, SELECTION, TARGET, PROPERTY, TIME = 5, 6, 7, 8, 9

Event = ctypes.c_long * 24
x11 = ctypes.CDLL('libX11.so.6')
x11.XOpenDisplay.restype = ctypes.c_void_p
for name in ('XDefaultRootWindow', 'XCreateSimpleWindow', 'XInternAtom'):
    getattr(x11, name).restype = ctypes.c_ulong


def main() -> None:
    window = int(sys.argv[1])
    uri = pathlib.Path(sys.argv[2]).absolute().as_uri().encode() + b'\r\n'
    display = ctypes.c_void_p(x11.XOpenDisplay(None))
    root = ctypes.c_ulong(x11.XDefaultRootWindow(display))
    source = x11.XCreateSimpleWindow(display, root, 0, 0, 1, 1, 0, ctypes.c_ulong(0),
                                     ctypes.c_ulong(0))

    def atom(text: str) -> int:
        return x11.XInternAtom(display, text.encode(), 0)

    def send(to: int, event: Event) -> None:
        x11.XSendEvent(display, ctypes.c_ulong(to), 0, ctypes.c_long(0), ctypes.byref(event))
        x11.XFlush(display)

    def message(kind: str, *data: int) -> None:
        event = Event(CLIENT_MESSAGE)
        event[WINDOW], event[MESSAGE_TYPE], event[FORMAT] = window, atom(kind), 32
        event[DATA], event[DATA + 1:DATA + 1 + len(data)] = source, data
        send(window, event)

    def wait(kind: str) -> Event:
        event = Event()
        while True:
            x11.XNextEvent(display, ctypes.byref(event))
            happened = event[0] & 0xffffffff
            if happened == SELECTION_REQUEST:
                give(event)
            elif happened == CLIENT_MESSAGE and event[MESSAGE_TYPE] == atom(kind):
                return event

    def give(request: Event) -> None:
        x11.XChangeProperty(display, ctypes.c_ulong(request[REQUESTOR]),
                            ctypes.c_ulong(request[PROPERTY]), ctypes.c_ulong(request[TARGET]), 8,
                            0, uri, len(uri))
        answer = Event(SELECTION_NOTIFY)
        answer[WINDOW:WINDOW + 5] = request[REQUESTOR:TIME + 1]
        send(request[REQUESTOR], answer)

    x11.XSetSelectionOwner(display, ctypes.c_ulong(atom('XdndSelection')), ctypes.c_ulong(source),
                           ctypes.c_ulong(0))
    message('XdndEnter', 5 << 24, atom('text/uri-list'), 0, 0)
    message('XdndPosition', 0, 100 << 16 | 100, 0, atom('XdndActionCopy'))
    if not wait('XdndStatus')[DATA + 1] & 1:
        sys.exit('the window takes no files')
    message('XdndDrop', 0, 0, 0, 0)
    wait('XdndFinished')


main()
