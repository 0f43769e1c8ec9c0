"""The coach: what the camera sees of the board now, whether that is a photograph to take, and where to hold it next.

::

    preview.py     one frame of the live picture: the board, found on a reduced image, and what is wrong with it
    knowledge.py   what the photographs taken so far tell: a camera, its uncertainty, what they lack
    lacking.py     what a set of views still needs by the seed's procedure
    next_view.py   where to hold the board next: the view that takes most of the uncertainty away
    wording.py     that, in words and drawn with characters
    moment.py      gauges of one frame, and whether this is the moment for a photograph

All of these are functions of frozen values, but for `preview`, which remembers the frame before.
"""

from opencsp_calib.coach.knowledge import Knowledge, learn
from opencsp_calib.coach.moment import Gauge, Moment, judge_moment
from opencsp_calib.coach.next_view import NextView
from opencsp_calib.coach.preview import Glance, Preview
from opencsp_calib.coach.wording import sketch

__all__ = ["Gauge", "Glance", "Knowledge", "Moment", "NextView", "Preview", "judge_moment", "learn", "sketch"]
