"""Makes pictures of this folder: every format, profiles, and what Pillow's littlecms makes of them in sRGB (*_srgb.png).

python pictures.py ART OUT, with ART = scenarios/art. The profiles are written here from published primaries and curves, so that they are free."""
import io, math, struct, sys
import numpy as np
from PIL import Image, ImageCms

ART, OUT = sys.argv[1], sys.argv[2]
D50 = np.array([0.9642, 1.0, 0.8249])
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


def s15(*v): return b"".join(struct.pack(">i", round(x * 65536)) for x in v)
def xyz(v): return b"XYZ \0\0\0\0" + s15(*v)
def text(t): return b"text\0\0\0\0" + t.encode() + b"\0"
def desc(t): return b"desc\0\0\0\0" + struct.pack(">I", len(t) + 1) + t.encode() + b"\0" + bytes(4 + 4 + 2 + 1 + 67)
def gamma(g): return b"curv\0\0\0\0" + struct.pack(">IH", 1, round(g * 256))
def curve(f, n=1024): return b"curv\0\0\0\0" + struct.pack(">I", n) + np.round(65535 * f(np.linspace(0, 1, n))).astype(">u2").tobytes()
def para3(g, a, b, c, d): return b"para\0\0\0\0" + struct.pack(">HH", 3, 0) + s15(g, a, b, c, d)


def profile(kind, space, pcs, tags):
    tags = {b"desc": desc("Calamus test"), b"cprt": text("public domain"), b"wtpt": xyz(D50), **tags}
    table, body, at = b"", b"", 132 + 12 * len(tags)
    for name, data in tags.items():
        table += name + struct.pack(">II", at, len(data))
        data += bytes(-len(data) % 4)
        body += data
        at += len(data)
    head = struct.pack(">I", at) + bytes(4) + b"\x02\x40\0\0" + kind + space + pcs + struct.pack(">6H", 2026, 1, 1, 0, 0, 0) + b"acsp" + bytes(28) + s15(*D50) + bytes(48)
    return head + struct.pack(">I", len(tags)) + table + body


def colorants(white, primaries):
    full = lambda x, y: np.array([x / y, 1.0, (1 - x - y) / y])
    p = np.array([full(*c) for c in primaries]).T
    w = full(*white)
    m = p * np.linalg.solve(p, w)
    adapt = np.linalg.inv(BRADFORD) @ np.diag(BRADFORD @ D50 / (BRADFORD @ w)) @ BRADFORD
    return (adapt @ m).T


def rgb(white, primaries, trc):
    r, g, b = colorants(white, primaries)
    return profile(b"mntr", b"RGB ", b"XYZ ", {b"rXYZ": xyz(r), b"gXYZ": xyz(g), b"bXYZ": xyz(b), b"rTRC": trc, b"gTRC": trc, b"bTRC": trc})


D65 = (0.3127, 0.3290)
srgb_light = lambda v: np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)
ADOBE = rgb(D65, [(0.64, 0.33), (0.21, 0.71), (0.15, 0.06)], gamma(563 / 256))
P3 = rgb(D65, [(0.68, 0.32), (0.265, 0.69), (0.15, 0.06)], para3(2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045))
WIDE = rgb((0.3457, 0.3585), [(0.7347, 0.2653), (0.1596, 0.8404), (0.0366, 0.0001)], curve(lambda v: v ** 1.8))
SAME = rgb(D65, [(0.64, 0.33), (0.30, 0.60), (0.15, 0.06)], curve(srgb_light))
GREY = profile(b"mntr", b"GRAY", b"XYZ ", {b"kTRC": gamma(1.8)})


def press(n, eight):
    """Four inks: Neugebauer's primaries mixed by Demichel's shares, with dot gain, as a table of n^4 from CMYK to Lab.

    The gain stands in the curves before the table where its numbers have eight bits, else in the table."""
    solid = {"c": [0.17, 0.23, 0.62], "m": [0.33, 0.17, 0.17], "y": [0.70, 0.77, 0.10], "k": [0.02, 0.02, 0.017]}
    paper = np.array([0.86, 0.89, 0.75])
    axis = np.linspace(0, 1, n)
    gain = lambda v: v + 0.3 * v * (1 - v)
    c, m, y, k = ((a if eight else gain(a))[..., None] for a in np.meshgrid(axis, axis, axis, axis, indexing="ij"))
    light = np.zeros(c.shape[:-1] + (3,))
    for bits in range(16):
        on = [bits >> i & 1 for i in range(4)]
        share = np.ones_like(c)
        color = paper.copy()
        for ink, v, is_on in zip("cmyk", (c, m, y, k), on):
            share = share * (v if is_on else 1 - v)
            if is_on:
                color = color * np.array(solid[ink]) / paper
        light = light + share * color
    t = light / D50 / (paper / D50).max()
    f = np.where(t > 216 / 24389, np.cbrt(t), (24389 / 27 * t + 16) / 116)
    L, a, b = 116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])
    lab = np.stack([L / 100, (a + 128) / 255, (b + 128) / 255], -1)
    shape = bytes([4, 3, n, 0]) + s15(1, 0, 0, 0, 1, 0, 0, 0, 1)
    if eight:
        line = np.arange(256)
        curve = np.round(255 * gain(line / 255)).astype(np.uint8).tobytes()
        lut = b"mft1\0\0\0\0" + shape + 4 * curve + np.round(255 * lab).clip(0, 255).astype(np.uint8).tobytes() + 3 * bytes(line.tolist())
    else:
        line = struct.pack(">HH", 0, 65535)
        lut = b"mft2\0\0\0\0" + shape + struct.pack(">HH", 2, 2) + 4 * line + np.round(65280 * lab).clip(0, 65535).astype(">u2").tobytes() + 3 * line
    return profile(b"prtr", b"CMYK", b"Lab ", {b"A2B0": lut})


def srgb_of(image, icc):
    source = ImageCms.ImageCmsProfile(io.BytesIO(icc))
    return ImageCms.profileToProfile(image, source, ImageCms.createProfile("sRGB"), renderingIntent=0, outputMode="RGB")


def photo():
    """Pieces of four pictures side by side, and full colours below."""
    boxes = [("portrait", (330, 250, 650, 570)), ("orchard", (250, 330, 570, 650)), ("pasture", (100, 300, 420, 620))]
    whole = Image.new("RGB", (72, 32))
    for i, (name, box) in enumerate(boxes):
        whole.paste(Image.open(f"{ART}/{name}.png").convert("RGB").crop(box).resize((24, 24), Image.LANCZOS), (24 * i, 0))
    for x in range(72):
        for y in range(8):
            h = 6 * x / 72
            full = [max(0, min(1, abs((h + o) % 6 - 3) - 1)) for o in (0, 4, 2)]
            v = [(f if y < 4 else 1 - (1 - f) * (8 - y) / 4) * (0.25 * (y + 1) if y < 4 else 1) for f in full]
            whole.putpixel((x, 24 + y), tuple(round(255 * c) for c in v))
    return whole


image = photo()
grey = image.convert("L")
ink = Image.merge("CMYK", [Image.fromarray(a) for a in (lambda k, r: [np.where(k < 255, ((255 - r[..., i] - 0.6 * k) / (1 - 0.6 * k / 255)).clip(0, 255), 0).astype(np.uint8) for i in range(3)] + [(0.6 * k).astype(np.uint8)])((255 - np.array(image).max(-1)).astype(float), np.array(image).astype(float))])


def put(name, picture, icc, **options):
    picture.save(f"{OUT}/{name}", icc_profile=icc, **options)
    stored = Image.open(f"{OUT}/{name}")
    assert stored.info["icc_profile"] == icc
    srgb_of(stored, icc).save(f"{OUT}/{name.replace('.', '_')}_srgb.png", optimize=True, icc_profile=None)


put("adobe_rgb.jpg", image, ADOBE, quality=100, subsampling=0)
put("display_p3.png", image, P3, optimize=True)
put("wide_gamut.webp", image, WIDE, lossless=True)
image.crop((0, 0, 24, 32)).save(f"{OUT}/same.png", icc_profile=SAME, optimize=True)
put("grey.tif", grey, GREY, compression="tiff_adobe_deflate")
put("press.jpg", ink, press(9, True), quality=90)
put("press.tif", ink, press(9, False), compression="tiff_adobe_deflate")

# The same 6 x 4 px in every format that loses nothing.
plain = Image.new("RGB", (6, 4))
for x in range(6):
    for y in range(4):
        plain.putpixel((x, y), (40 * x, 60 * y, 200 - 20 * x))
plain.save(f"{OUT}/plain.png", optimize=True)
plain.save(f"{OUT}/plain.webp", lossless=True)
plain.save(f"{OUT}/plain.bmp")
plain.save(f"{OUT}/plain.qoi")
plain.save(f"{OUT}/plain.tif", compression="tiff_lzw")
other = plain.transpose(Image.Transpose.ROTATE_180)
plain.save(f"{OUT}/plain.gif")
plain.save(f"{OUT}/moving.gif", save_all=True, append_images=[other], duration=100)
plain.save(f"{OUT}/moving.webp", save_all=True, append_images=[other], duration=100, lossless=True)
plain.save(f"{OUT}/moving.png", save_all=True, append_images=[other], duration=100)
plain.save(f"{OUT}/pages.tif", save_all=True, append_images=[other])
image.crop((24, 0, 48, 24)).save(f"{OUT}/lossy.webp", quality=60)
image.crop((24, 0, 48, 24)).save(f"{OUT}/lossy_progressive.jpg", quality=80, progressive=True)
image.crop((24, 0, 48, 24)).save(f"{OUT}/lossy.jpg", quality=80)

# Red left of blue, to be turned by a quarter.
turned = Image.new("RGB", (16, 8), (255, 0, 0))
turned.paste((0, 0, 255), (8, 0, 16, 8))
exif = Image.Exif()
exif[0x0112] = 6
turned.save(f"{OUT}/turned.webp", lossless=True, exif=exif)
turned.save(f"{OUT}/turned.png", exif=exif)
turned.save(f"{OUT}/turned.tif", tiffinfo={0x0112: 6})

# Half-transparent red, stored times its alpha.
rgba = np.zeros((1, 2, 4), np.uint8)
rgba[0, 0] = (128, 0, 0, 128)
file = io.BytesIO()
Image.fromarray(rgba).save(file, "tiff")
tag = lambda kind: struct.pack("<HHIHH", 338, 3, 1, kind, 0)
assert tag(2) in file.getvalue()
open(f"{OUT}/associated.tif", "wb").write(file.getvalue().replace(tag(2), tag(1)))

# Linear light of 0.25, 0.5, 1 and 2.
e = lambda v: bytes([int(v * 256 / 2.0 ** (1 + math.floor(math.log2(v))))] * 3 + [129 + math.floor(math.log2(v))])
open(f"{OUT}/light.hdr", "wb").write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 4\n" + b"".join(e(v) for v in (0.25, 0.5, 1.0, 2.0)))
