"""The calibration window, a page in the browser: ``opencsp-calib gui``. A thin face of the same functions as the CLI.

::

    loading.py   loads all this quickly                  server.py  starts: socket, token, address
    guard.py     who may ask at all
    session.py   what has been chosen and found so far, kept in a folder in DIR by session_file.py
    settings.py  what is typed and chosen                 board_text.py  the board that it describes
    offered.py   what plugins offer here
    work.py      hands long work to jobs.py, which runs in a process of its own;
    live_capture.py does so with a capture, to capture_job.py
    thumbnails.py  made where a photograph is decoded anyway
    files.py     which files may be touched             routes.py  photographs in, thumbnails and results out
    page.py      the page, and which file each of its sections is in
    *.js         the few elements that NiceGUI does not have; style.css, how all of it looks

NiceGUI is imported here and nowhere else (extra ``gui``). The first page is there before what only results need, such
as the report and its plots, is loaded: that is imported where it is used.
"""
