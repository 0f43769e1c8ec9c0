"""What goes to and from the browser beside the page itself: photographs in, thumbnails, photographs and results out."""

import asyncio
import filecmp
import os
from collections.abc import AsyncIterator
from pathlib import Path

from fastapi import APIRouter, HTTPException, Request, Response
from fastapi.responses import FileResponse

from opencsp_calib.errors import CalibError, InputError
from opencsp_calib.gui.files import file_name, within
from opencsp_calib.gui.session import Session
from opencsp_calib.gui.thumbnails import THUMBNAIL_PX
from opencsp_calib.images import MAX_BYTES, ImageFile, encode_thumbnail, read_image

__all__ = ["WHOLE_PX", "routes"]

WHOLE_PX = 100_000
PIECE = 2**20  # bytes of an upload that are written at once


def routes(session: Session) -> APIRouter:
    """The addresses, for one session."""
    router = APIRouter()
    _incoming(router, session)
    _outgoing(router, session)
    return router


def _incoming(router: APIRouter, session: Session) -> None:
    @router.put("/photographs")
    async def take(request: Request, name: str, batch: str, count: int) -> dict[str, str]:
        try:
            return {"saved": await _saved(request.stream(), session.selection.uploads, file_name(name, "photograph"))}
        except (InputError, OSError) as error:
            session.say(f"{name} cannot be kept: {error}", "bad")
            raise HTTPException(507, str(error)) from None
        finally:
            if session.selection.received(batch, count):
                session.end_batch(batch)
            session.tell_soon()

    @router.put("/cameras")
    async def take_camera(request: Request, name: str) -> dict[str, str]:
        try:
            saved = await _saved(request.stream(), session.own / "cameras", file_name(name, "camera"))
        except (InputError, OSError) as error:
            raise HTTPException(507, str(error)) from None
        return {"path": f"{session.own.name}/cameras/{saved}"}


def _outgoing(router: APIRouter, session: Session) -> None:
    # one of each at a time: few photographs in memory, and a whole one does not wait for thumbnails
    small, whole = asyncio.Semaphore(1), asyncio.Semaphore(1)

    @router.get("/photographs")
    async def give(image: str, side: int = THUMBNAIL_PX) -> Response:
        path = session.selection.paths.get(image)
        if path is None:
            raise HTTPException(404)
        make = session.thumbnails.of if side <= THUMBNAIL_PX else _whole
        async with small if side <= THUMBNAIL_PX else whole:
            if side <= THUMBNAIL_PX and session.looking and image not in session.views:
                return Response(status_code=204)  # it is made where the board is looked for, and asked for then
            try:
                data = await asyncio.to_thread(make, path)
            except (CalibError, OSError) as error:
                raise HTTPException(404, str(error)) from None
        return Response(data, media_type="image/jpeg", headers={"cache-control": "private, max-age=60"})

    @router.get("/files")
    async def download(path: str) -> Response:
        try:
            wanted = within(session.folder, path)
        except InputError as error:
            raise HTTPException(403, str(error)) from None
        if not wanted.is_file():
            raise HTTPException(404)
        return FileResponse(wanted, filename=wanted.name, media_type="application/octet-stream")


async def _saved(chunks: AsyncIterator[bytes], folder: Path, name: str) -> str:
    """Keep a file as it comes; one of the same name and content is kept once, one of other content beside it."""
    folder.mkdir(parents=True, exist_ok=True)
    target = folder / name
    part = folder.parent / f".receiving-{os.urandom(8).hex()}"
    size, piece = 0, bytearray()
    try:
        with part.open("wb") as file:
            async for chunk in chunks:
                size += len(chunk)
                if size > MAX_BYTES:
                    raise InputError(f"it is larger than {MAX_BYTES >> 30} GiB")
                piece += chunk
                if len(piece) >= PIECE:
                    await asyncio.to_thread(file.write, piece)
                    piece = bytearray()
            await asyncio.to_thread(file.write, piece)
        number = 1
        while target.exists():
            if await asyncio.to_thread(filecmp.cmp, part, target, shallow=False):
                return target.name
            number += 1
            target = folder / f"{Path(name).stem} ({number}){Path(name).suffix}"
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)
    return target.name


def _whole(path: Path) -> bytes:
    """A photograph as the browser can show it."""
    return encode_thumbnail(read_image(ImageFile(path.name, path)).pixels, WHOLE_PX)
