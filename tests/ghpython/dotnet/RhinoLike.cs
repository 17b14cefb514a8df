// As much of RhinoCommon and of Grasshopper as weavecore calls, with the same names and signatures, so that the
// way through .NET's arrays can be run where there is no Rhino.  Points are plain structures, as Rhino's are.
using System;
using System.Collections;
using System.Collections.Generic;
using System.Linq;
using System.Runtime.InteropServices;

namespace Rhino
{
    public enum UnitSystem { None = 0, Millimeters = 2, Centimeters = 3, Meters = 4 }

    public class RhinoDoc
    {
        public static RhinoDoc ActiveDoc { get; set; }
        public UnitSystem ModelUnitSystem { get; set; }
        public double ModelAbsoluteTolerance { get; set; }
        public DocObjects.Tables.ObjectTable Objects { get; } = new DocObjects.Tables.ObjectTable();
    }
}

namespace Rhino.DocObjects
{
    public class RhinoObject { public Geometry.GeometryBase Geometry { get; set; } }
}

namespace Rhino.DocObjects.Tables
{
    public class ObjectTable
    {
        readonly Dictionary<Guid, RhinoObject> m_objects = new Dictionary<Guid, RhinoObject>();

        public Guid Add(Geometry.GeometryBase geometry)
        {
            var id = Guid.NewGuid();
            m_objects[id] = new RhinoObject { Geometry = geometry };
            return id;
        }

        public RhinoObject FindId(Guid id)
        {
            RhinoObject found;
            return m_objects.TryGetValue(id, out found) ? found : null;
        }
    }
}

namespace Rhino.Geometry
{
    [StructLayout(LayoutKind.Sequential, Pack = 8, Size = 24)]
    public struct Point3d
    {
        double m_x, m_y, m_z;
        public Point3d(double x, double y, double z) { m_x = x; m_y = y; m_z = z; }
        public double X { get { return m_x; } set { m_x = value; } }
        public double Y { get { return m_y; } set { m_y = value; } }
        public double Z { get { return m_z; } set { m_z = value; } }
        public static Vector3d operator -(Point3d a, Point3d b) { return new Vector3d(a.X - b.X, a.Y - b.Y, a.Z - b.Z); }
    }

    public struct Point3f { public float X, Y, Z; }

    [StructLayout(LayoutKind.Sequential, Pack = 8, Size = 24)]
    public struct Vector3d
    {
        double m_x, m_y, m_z;
        public Vector3d(double x, double y, double z) { m_x = x; m_y = y; m_z = z; }
        public double X { get { return m_x; } }
        public double Y { get { return m_y; } }
        public double Z { get { return m_z; } }
        public double Length { get { return Math.Sqrt(m_x * m_x + m_y * m_y + m_z * m_z); } }
    }

    [StructLayout(LayoutKind.Sequential, Pack = 8, Size = 48)]
    public struct Line
    {
        Point3d m_from, m_to;
        public Line(Point3d from, Point3d to) { m_from = from; m_to = to; }
        public Line(double x0, double y0, double z0, double x1, double y1, double z1)
        {
            m_from = new Point3d(x0, y0, z0);
            m_to = new Point3d(x1, y1, z1);
        }
        public Point3d From { get { return m_from; } }
        public Point3d To { get { return m_to; } }
    }

    [StructLayout(LayoutKind.Sequential, Pack = 4, Size = 16)]
    public struct MeshFace
    {
        int m_a, m_b, m_c, m_d;
        public MeshFace(int a, int b, int c, int d) { m_a = a; m_b = b; m_c = c; m_d = d; }
        public int A { get { return m_a; } }
        public int B { get { return m_b; } }
        public int C { get { return m_c; } }
        public int D { get { return m_d; } }
    }

    public struct Plane
    {
        public Plane(Point3d origin, Vector3d normal) : this() { Origin = origin; Normal = normal; }
        public Point3d Origin { get; set; }
        public Vector3d Normal { get; private set; }
        public Vector3d XAxis { get { return new Vector3d(Normal.Y, Normal.Z, Normal.X); } }
        public Vector3d YAxis { get { return new Vector3d(Normal.Z, Normal.X, Normal.Y); } }
    }

    public struct BoundingBox
    {
        public BoundingBox(IEnumerable<Point3d> points) : this()
        {
            Min = new Point3d(points.Min(p => p.X), points.Min(p => p.Y), points.Min(p => p.Z));
            Max = new Point3d(points.Max(p => p.X), points.Max(p => p.Y), points.Max(p => p.Z));
        }
        public Point3d Min { get; set; }
        public Point3d Max { get; set; }
        public Vector3d Diagonal { get { return Max - Min; } }
    }

    public abstract class GeometryBase
    {
        public abstract BoundingBox GetBoundingBox(bool accurate);
        public virtual uint DataCRC(uint currentRemainder) { return currentRemainder + 17; }
    }

    public class Polyline : List<Point3d>
    {
        public Polyline() { }
        public Polyline(int initialCapacity) : base(initialCapacity) { }
        public Polyline(IEnumerable<Point3d> collection) : base(collection) { }
    }

    public abstract class Curve : GeometryBase { }

    public class PolylineCurve : Curve
    {
        readonly Polyline m_points;
        public PolylineCurve(IEnumerable<Point3d> points) { m_points = new Polyline(points); }
        public int PointCount { get { return m_points.Count; } }
        public Point3d Point(int index) { return m_points[index]; }
        public bool IsClosed { get { return m_points[0].Equals(m_points[m_points.Count - 1]); } }
        public override BoundingBox GetBoundingBox(bool accurate) { return new BoundingBox(m_points); }
    }

    public class NurbsCurveKnotList : IEnumerable<double>
    {
        readonly double[] m_knots;
        internal NurbsCurveKnotList(int count) { m_knots = new double[count]; }
        public int Count { get { return m_knots.Length; } }
        public double this[int index] { get { return m_knots[index]; } set { m_knots[index] = value; } }
        public IEnumerator<double> GetEnumerator() { return ((IEnumerable<double>)m_knots).GetEnumerator(); }
        IEnumerator IEnumerable.GetEnumerator() { return GetEnumerator(); }
    }

    public class NurbsCurve : Curve
    {
        Point3d[] m_points;
        public int Degree { get; private set; }
        public NurbsCurveKnotList Knots { get; private set; }
        public static NurbsCurve Create(bool periodic, int degree, IEnumerable<Point3d> points)
        {
            var controls = points.ToArray();
            if (periodic || controls.Length <= degree) return null;
            var knots = new NurbsCurveKnotList(controls.Length + degree - 1);
            return new NurbsCurve { Degree = degree, m_points = controls, Knots = knots };
        }
        public int PointCount { get { return m_points.Length; } }
        public override BoundingBox GetBoundingBox(bool accurate) { return new BoundingBox(m_points); }
    }

    public class MeshVertexList
    {
        internal readonly List<Point3d> m_points = new List<Point3d>();
        public bool UseDoublePrecisionVertices { get; set; }
        public int Count { get { return m_points.Count; } }
        public void AddVertices(IEnumerable<Point3d> vertices)
        {
            foreach (var p in vertices)
                m_points.Add(UseDoublePrecisionVertices ? p : new Point3d((float)p.X, (float)p.Y, (float)p.Z));
        }
        public void AddVertices(IEnumerable<Point3f> vertices)
        {
            throw new NotSupportedException("single precision was chosen");
        }
        public Point3d[] ToPoint3dArray() { return m_points.ToArray(); }
    }

    public class MeshFaceList
    {
        internal readonly List<MeshFace> m_faces = new List<MeshFace>();
        public int Count { get { return m_faces.Count; } }
        public int[] AddFaces(IEnumerable<MeshFace> faces)
        {
            int first = m_faces.Count;
            m_faces.AddRange(faces);
            return Enumerable.Range(first, m_faces.Count - first).ToArray();
        }
        public int[] ToIntArray(bool asTriangles)
        {
            if (asTriangles) throw new NotSupportedException("Rhino would split quads in a way of its own");
            return m_faces.SelectMany(f => new[] { f.A, f.B, f.C, f.D }).ToArray();
        }
    }

    public class MeshVertexNormalList
    {
        public bool ComputeNormals() { return true; }
    }

    public class MeshingParameters
    {
        public bool JaggedSeams { get; set; } = true;
        public bool SimplePlanes { get; set; } = true;
        public bool RefineGrid { get; set; }
        public double MaximumEdgeLength { get; set; }
        public double Tolerance { get; set; }
    }

    public class Mesh : GeometryBase
    {
        public MeshVertexList Vertices { get; } = new MeshVertexList();
        public MeshFaceList Faces { get; } = new MeshFaceList();
        public MeshVertexNormalList Normals { get; } = new MeshVertexNormalList();
        public override BoundingBox GetBoundingBox(bool accurate) { return new BoundingBox(Vertices.m_points); }

        // Each face of a box-like Brep as a grid of quads, as fine as the parameters ask for.
        public static Mesh[] CreateFromBrep(Brep brep, MeshingParameters parameters)
        {
            if (parameters.JaggedSeams) throw new ArgumentException("meshes of faces would not fit to one another");
            return brep.IsHopeless ? null : brep.Patches.Select(p => p.Grid(parameters.MaximumEdgeLength)).ToArray();
        }

        public static Mesh CreateFromSubD(SubD subd, int displayDensity)
        {
            return subd.Patch.Grid(subd.Patch.Size / (1 << displayDensity));
        }
    }

    // A rectangle from a corner along two sides.
    public class Patch
    {
        readonly Point3d m_corner;
        readonly Vector3d m_u, m_v;
        public Patch(Point3d corner, Vector3d u, Vector3d v) { m_corner = corner; m_u = u; m_v = v; }
        public double Size { get { return Math.Max(m_u.Length, m_v.Length); } }
        public Point3d At(double s, double t)
        {
            return new Point3d(
                m_corner.X + s * m_u.X + t * m_v.X, m_corner.Y + s * m_u.Y + t * m_v.Y, m_corner.Z + s * m_u.Z + t * m_v.Z);
        }
        public IEnumerable<Point3d> Corners { get { return new[] { At(0, 0), At(1, 0), At(1, 1), At(0, 1) }; } }
        public Mesh Grid(double edge)
        {
            int n = Math.Max(1, (int)Math.Ceiling(m_u.Length / edge)), m = Math.Max(1, (int)Math.Ceiling(m_v.Length / edge));
            var mesh = new Mesh();
            mesh.Vertices.UseDoublePrecisionVertices = true;
            mesh.Vertices.AddVertices(
                from j in Enumerable.Range(0, m + 1) from i in Enumerable.Range(0, n + 1) select At((double)i / n, (double)j / m));
            mesh.Faces.AddFaces(
                from j in Enumerable.Range(0, m) from i in Enumerable.Range(0, n)
                let a = j * (n + 1) + i select new MeshFace(a, a + 1, a + n + 2, a + n + 1));
            return mesh;
        }
    }

    public class Brep : GeometryBase
    {
        public Brep(params Patch[] patches) { Patches = patches; }
        public Patch[] Patches { get; private set; }
        public bool IsHopeless { get; set; }
        public IList<Patch> Faces { get { return Patches; } }
        public IList<Patch> Loops { get { return Patches; } }
        public override BoundingBox GetBoundingBox(bool accurate) { return new BoundingBox(Patches.SelectMany(p => p.Corners)); }
    }

    public abstract class Surface : GeometryBase
    {
        protected Patch m_patch;
        public Brep ToBrep() { return new Brep(m_patch); }
        public override BoundingBox GetBoundingBox(bool accurate) { return new BoundingBox(m_patch.Corners); }
    }

    public class BrepFace : Surface
    {
        public BrepFace(Patch patch) { m_patch = patch; }
        public IList<Patch> Loops { get { return new[] { m_patch }; } }
        public Brep DuplicateFace(bool duplicateMeshes) { return base.ToBrep(); }
        public new Brep ToBrep() { throw new NotSupportedException("its trims would be lost"); }
    }

    public class PlaneSurface : Surface
    {
        public PlaneSurface(Patch patch) { m_patch = patch; }
    }

    public class Extrusion : Surface
    {
        public Extrusion(Patch patch) { m_patch = patch; }
        public Vector3d PathTangent { get { return new Vector3d(0, 0, 1); } }
        public Brep ToBrep(bool splitKinkyFaces) { return splitKinkyFaces ? base.ToBrep() : null; }
    }

    public class SubDFaceList { public int Count { get; set; } }

    public class SubD : GeometryBase
    {
        public SubD(Patch patch, int faces) { Patch = patch; Faces = new SubDFaceList { Count = faces }; }
        public Patch Patch { get; private set; }
        public SubDFaceList Faces { get; private set; }
        public bool Subdivide(int count) { return true; }
        public Brep ToBrep() { throw new NotSupportedException("a mesh is made of the SubD itself"); }
        public override BoundingBox GetBoundingBox(bool accurate) { return new BoundingBox(Patch.Corners); }
    }
}

namespace Grasshopper.Kernel.Data
{
    public class GH_Path : IEquatable<GH_Path>
    {
        public GH_Path(params int[] args) { Indices = args; }
        public int[] Indices { get; private set; }
        public bool Equals(GH_Path other) { return other != null && Indices.SequenceEqual(other.Indices); }
        public override bool Equals(object other) { return Equals(other as GH_Path); }
        public override int GetHashCode() { return Indices.Aggregate(17, (hash, i) => 31 * hash + i); }
        public override string ToString() { return "{" + string.Join(";", Indices) + "}"; }
    }
}

namespace Grasshopper
{
    using Grasshopper.Kernel.Data;

    public class DataTree<T>
    {
        readonly Dictionary<GH_Path, List<T>> m_branches = new Dictionary<GH_Path, List<T>>();
        readonly List<GH_Path> m_paths = new List<GH_Path>();
        public int BranchCount { get { return m_paths.Count; } }
        public GH_Path Path(int index) { return m_paths[index]; }
        public List<T> Branch(int index) { return m_branches[m_paths[index]]; }
        public List<T> EnsurePath(GH_Path path)
        {
            List<T> branch;
            if (!m_branches.TryGetValue(path, out branch))
            {
                m_paths.Add(path);
                m_branches[path] = branch = new List<T>();
            }
            return branch;
        }
        public void Add(T data, GH_Path path) { EnsurePath(path).Add(data); }
        // What .NET sees of an item: that it is a number of Python's would not show in Python.
        public string TypeNameOf(int branch, int item) { return Branch(branch)[item].GetType().FullName; }
    }
}

namespace Grasshopper.Kernel
{
    public enum GH_RuntimeMessageLevel { Blank = 0, Warning = 10, Error = 20, Remark = 255 }
    public class GH_ScriptInstance { }
    public class GH_Document
    {
        public static bool EscapeKeyDown { get; set; }
        public string FilePath { get; set; }
        public static bool IsEscapeKeyDown() { return EscapeKeyDown; }
    }
    public interface IGH_InstanceDescription { string Name { get; set; } string NickName { get; set; } }
    public interface IGH_Param : IGH_InstanceDescription { int SourceCount { get; } }
    public class Param : IGH_Param
    {
        public string Name { get; set; }
        public string NickName { get; set; }
        public int SourceCount { get; set; }
    }
    public class ComponentParams { public List<IGH_Param> Input { get; } = new List<IGH_Param>(); }
    public class Component
    {
        public Guid InstanceGuid { get; } = Guid.NewGuid();
        public string Message { get; set; }
        public ComponentParams Params { get; } = new ComponentParams();
        public List<string> Messages { get; } = new List<string>();
        public GH_Document Document { get; set; }
        public GH_Document OnPingDocument() { return Document; }
        public void AddRuntimeMessage(GH_RuntimeMessageLevel level, string text) { Messages.Add(level + ": " + text); }
    }
}
