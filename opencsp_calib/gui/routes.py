"""What goes to and from the browser beside the page itself: photographs in, thumbnails, photographs and results out."""

import asyncio
import hashlib
import os
from collections.abc import AsyncIterator
from pathlib import Path

from fastapi import APIRouter, HTTPException, Request, Response
from fastapi.responses import FileResponse

from opencsp_calib.errors import CalibError, InputError
from opencsp_calib.gui.files import file_name, within
from opencsp_calib.gui.session import Session
from opencsp_calib.images import MAX_BYTES, ImageFile, encode_thumbnail, read_image

__all__ = ["WHOLE_PX", "routes"]

THUMBNAIL_PX = 320
WHOLE_PX = 100_000


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
        path = session.selection.path_of(image)
        if path is None:
            raise HTTPException(404)
        async with whole if side > THUMBNAIL_PX else small:
            try:
                data = await asyncio.to_thread(_picture, path, side, session.own / "thumbnails")
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
    digest, size = hashlib.sha256(), 0
    try:
        with part.open("wb") as file:
            async for chunk in chunks:
                size += len(chunk)
                if size > MAX_BYTES:
                    raise InputError(f"it is larger than {MAX_BYTES >> 30} GiB")
                digest.update(chunk)
                await asyncio.to_thread(file.write, chunk)
        number = 1
        while target.exists():
            if hashlib.sha256(target.read_bytes()).digest() == digest.digest():
                return target.name
            number += 1
            target = folder / f"{Path(name).stem} ({number}){Path(name).suffix}"
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)
    return target.name


def _picture(path: Path, side: int, cache: Path) -> bytes:
    """A photograph as the browser can show it, small or whole; small ones are kept."""
    if side > THUMBNAIL_PX:
        return encode_thumbnail(read_image(ImageFile(path.name, path)).pixels, WHOLE_PX)
    stat = path.stat()
    key = hashlib.sha256(f"{path} {stat.st_mtime_ns} {stat.st_size}".encode()).hexdigest()[:32]
    kept = cache / f"{key}.jpg"
    if kept.is_file():
        return kept.read_bytes()
    data = encode_thumbnail(read_image(ImageFile(path.name, path)).pixels, THUMBNAIL_PX)
    cache.mkdir(parents=True, exist_ok=True)
    part = kept.with_suffix(f".{os.urandom(4).hex()}")
    part.write_bytes(data)
    part.replace(kept)
    return data
